"""Linear models as .mat files of version 5, which MATLAB and scipy read."""

from io import BytesIO

import numpy as np

from ...linear.state_space import StateSpace


def mat_file(model: StateSpace) -> bytes:
    """A, B, C, D, Ts (0: continuous), InputName and OutputName (cells of text).

    In MATLAB: m = load(FILE); ss(m.A, m.B, m.C, m.D, m.Ts, 'InputName', m.InputName, 'OutputName', m.OutputName).
    In Python: m = scipy.io.loadmat(FILE); control.ss(m["A"], m["B"], m["C"], m["D"], m["Ts"].item()).
    """
    from scipy.io import savemat

    target = BytesIO()
    names = {"InputName": model.input_labels, "OutputName": model.output_labels}
    cells = {key: np.array([[label] for label in labels], dtype=object) for key, labels in names.items()}
    matrices = dict(zip("ABCD", model.matrices, strict=True))
    savemat(target, {**matrices, "Ts": float(model.dt), **cells})
    return target.getvalue()
