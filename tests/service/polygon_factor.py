"""Lambert's formula (1760) for what points see of a polygon."""

import numpy as np


def polygon_factor(points, normal, corners):
    """Factors of points to a polygon before them: sum angle_k n . (r_k x r_k+1) / |r_k x r_k+1| / 2 pi."""
    to = np.asarray(corners)[None] - points[:, None]
    to /= np.linalg.norm(to, axis=2, keepdims=True)
    total = 0
    for k in range(len(corners)):
        a, b = to[:, k], to[:, (k + 1) % len(corners)]
        across = np.cross(a, b)
        length = np.linalg.norm(across, axis=1)
        total = total + np.arctan2(length, (a * b).sum(1)) * (across @ normal) / length
    return np.abs(total) / (2 * np.pi)
