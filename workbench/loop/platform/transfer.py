"""The closed loop of a platform, linear: poles, sensitivity, and the transfer from the pose asked for, 6 x 6."""

from dataclasses import dataclass

import numpy as np

from ...control.platform_controller import LEGS, PlatformController
from ...control.protocol import linear_view
from ...linear.linearisation import jacobians
from ...linear.sampling import zero_order_hold
from ...rigs.platform import AXES, leg_speeds, pose_rates
from .setup import PlatformSetup

JUDGED = 5.0  # Hz: at which couplings are told


@dataclass(frozen=True)
class PlatformTransfer:
    """`poles` of the sampled loop; at frequencies f [k], Hz, the transfer [k, 6, 6] from the pose that is asked for
    (columns) to the pose (rows), angles times the radius of the joints; `sensitivity` [k], the largest singular value
    of that of the legs."""

    poles: np.ndarray
    f: np.ndarray
    transfer: np.ndarray
    sensitivity: np.ndarray

    @property
    def stable(self) -> bool:
        """Whether every disturbance dies away."""
        return bool(np.abs(self.poles).max() < 1.0)

    def coupling(self, into: str, of: str, hz: float = JUDGED) -> float:
        """Amplitude of one axis for a unit amplitude that another is asked for, at a frequency [Hz]."""
        gain = np.abs(self.transfer[:, AXES.index(into), AXES.index(of)])
        return float(np.interp(hz, self.f, gain))


def platform_transfer(setup: PlatformSetup, controller: PlatformController, f: np.ndarray) -> PlatformTransfer:
    """A controller's linear loop at the setup's operating point. Raises NoLinearView for a law without one."""
    period, n = setup.platform.period, len(controller.measures)
    a, b, c, _ = _plant(setup, controller.measures)
    al, bl, cl, dl = _laws(setup, controller)
    u = controller.directions
    r, signals = _seen(controller)
    y = signals @ c[: LEGS * n]
    out = _map_slopes(setup, controller)[:, None] * u
    closed = np.block([[a + b @ out @ dl @ y, b @ out @ cl], [bl @ y, al]])
    entering = np.vstack((b @ out @ dl @ r, bl @ r))
    poses = np.hstack((c[LEGS * n :], np.zeros((LEGS, len(al)))))
    forward = np.vstack((b @ out, np.zeros((len(al), LEGS))))
    z = np.exp(2j * np.pi * f * period)[:, None, None]
    resolvent = z * np.eye(len(closed)) - closed
    into = (entering + forward @ _forward(controller, f) @ u.T) * _smoothing(controller, f, period)[:, None, None]
    legs = np.linalg.solve(resolvent, into)
    weights = setup.platform.geometry.weights
    transfer = weights[:, None] * (poses @ legs @ _leg_per_pose(setup)) / weights
    loop = _sensitivity(z, (a, b, y), (al, bl, cl, dl), out)
    return PlatformTransfer(np.linalg.eigvals(closed), f, transfer, loop)


def _plant(setup: PlatformSetup, measures: tuple[str, ...]) -> tuple[np.ndarray, ...]:
    """The plant sampled, from commands to what the legs measure, leg by leg, and the pose."""
    plant = setup.engine.plant
    outputs = tuple(f"leg{i + 1}.{name}" for i in range(LEGS) for name in measures) + AXES
    commands = tuple(f"command{i + 1}" for i in range(LEGS))
    matrices = jacobians(plant, setup.smooth, commands, outputs, setup.p_smooth)
    return zero_order_hold(matrices, plant.lateness(), setup.platform.period)


def _laws(setup: PlatformSetup, controller: PlatformController) -> tuple[np.ndarray, ...]:
    """All laws side by side, each from its reference and signals."""
    from scipy.linalg import block_diag

    views = [linear_view(law, at) for law, at in zip(controller.laws, _points(setup, controller), strict=True)]
    return tuple(np.array(block_diag(*(getattr(view, name) for view in views))) for name in "ABCD")


def _points(setup: PlatformSetup, controller: PlatformController) -> list[dict[str, float]]:
    """The operating point as each law sees it."""
    plant = setup.engine.plant
    outputs = plant.observe(setup.smooth.x, setup.smooth.u, setup.p_smooth)[0]
    names = [name[5:] for name in plant.outputs if name.startswith("leg1.")]
    legs = {name: np.array([outputs[plant.output(f"leg{i + 1}.{name}")] for i in range(LEGS)]) for name in names}
    own = {name: controller.directions.T @ values for name, values in legs.items()}
    own["command"] = controller.directions.T @ setup.smooth.u[:LEGS]
    return [{name: float(values[j]) for name, values in own.items()} for j in range(LEGS)]


def _seen(controller: PlatformController) -> tuple[np.ndarray, np.ndarray]:
    """From the references of the legs, and from all their signals, to the inputs of each law, one after another."""
    u, measures = controller.directions.T, controller.measures
    mixed, none = np.kron(u, np.eye(len(measures))), np.zeros(LEGS)
    rows = []
    for j, law in enumerate(controller.laws):
        rows.append((u[j], np.zeros(len(mixed))))
        rows += [(none, mixed[j * len(measures) + measures.index(name)]) for name in law.measures]
    references, signals = zip(*rows, strict=True)
    return np.array(references), np.array(signals)


def _map_slopes(setup: PlatformSetup, controller: PlatformController) -> np.ndarray:
    """Slopes [6] of the maps of the commands at the operating point."""
    if controller.command_map is None:
        return np.ones(LEGS)
    commands = setup.smooth.u[:LEGS]
    before = commands + controller.command_map.back.over(commands)
    return np.array([1.0 + controller.command_map.shift.slope(float(value)) for value in before])


def _forward(controller: PlatformController, f: np.ndarray) -> np.ndarray:
    """Feed-forward [k, 6, 6] of the references of the laws, the derivatives those of continuous time."""
    if not controller.forward:
        return np.zeros((len(f), LEGS, LEGS))
    powers = (2j * np.pi * f[:, None]) ** [1, 2, 3]
    per_law = powers @ np.transpose([forward.gains for forward in controller.forward])
    return per_law[:, :, None] * np.eye(LEGS)


def _smoothing(controller: PlatformController, f: np.ndarray, period: float) -> np.ndarray:
    """The response [k] of the filter that smooths the pose asked for."""
    return np.ones(len(f)) if controller.smoothing is None else controller.smoothing.response(f, period)


def _leg_per_pose(setup: PlatformSetup) -> np.ndarray:
    """Leg positions per pose [6, 6] at the operating point."""
    first = setup.engine.plant.state(AXES[0])
    pose = setup.smooth.x[first : first + LEGS]
    return leg_speeds(setup.platform.geometry, pose) @ np.linalg.inv(pose_rates(pose))


def _sensitivity(
    z: np.ndarray, plant: tuple[np.ndarray, ...], laws: tuple[np.ndarray, ...], out: np.ndarray
) -> np.ndarray:
    """Largest singular value [k] of the sensitivity at the commands."""
    (a, b, y), (al, bl, cl, dl) = plant, laws
    signals = y @ np.linalg.solve(z * np.eye(len(a)) - a, b.astype(complex))
    law = cl @ np.linalg.solve(z * np.eye(len(al)) - al, bl.astype(complex)) + dl
    loop = np.eye(LEGS) - out @ law @ signals
    return np.linalg.norm(np.linalg.inv(loop), 2, axis=(1, 2))
