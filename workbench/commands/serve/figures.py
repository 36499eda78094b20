"""Times of a service, out of histograms of whole microseconds."""

import numpy as np

SHARES = {"p50": 0.5, "p99": 0.99, "p999": 0.999}


def quantiles(counts: np.ndarray) -> dict[str, float | None]:
    """Quantiles [us] of a histogram whose bin k has the times from k to k + 1 us, and the worst; None of none."""
    total = int(counts.sum())
    if not total:
        return {**dict.fromkeys(SHARES), "worst": None}
    reached = np.cumsum(counts)
    found = {name: float(np.searchsorted(reached, share * total)) for name, share in SHARES.items()}
    return {**found, "worst": float(np.flatnonzero(counts)[-1])}


def steps(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The share of times above x [us], for a figure: both [k], of the bins that hold any."""
    held = np.flatnonzero(counts)
    above = 1 - np.cumsum(counts[held]) / max(1, counts.sum())
    return held + 0.5, np.maximum(above, 0.5 / max(1, int(counts.sum())))
