"""What the rod of a leg bears beside its load cell's force."""

import numpy as np

from ...rigs.platform import Platform
from ...rigs.platform.kinematics import leg_vectors


def rod_burden(platform: Platform, t: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """What a rod bears beside its load cell's force and the inertia along its leg, [n, 6] N, at times t [n] in poses
    [n, 6]: m (g cos - w^2 r), its weight along the leg less the centripetal force of its centre, r from the base joint.

    Both follow from the energy of `workbench.plant.platform_body`. They change by some 50 N over a stroke, which moves
    a jack that nothing holds by 0.1 mm in some seconds.
    """
    vectors = leg_vectors(platform.geometry, poses)
    lengths = np.linalg.norm(vectors, axis=-1)
    along = vectors / lengths[..., None]
    turning = np.sum(np.gradient(along, t, axis=0) ** 2, axis=-1)
    centre = np.array([leg.numbers["rod_centre"].value for leg in platform.legs])
    return rod_masses(platform) * (platform["gravity"] * along[..., 2] - turning * (lengths - centre))


def rod_masses(platform: Platform) -> np.ndarray:
    """[6], kg."""
    return np.array([leg.numbers["rod_mass"].value for leg in platform.legs])
