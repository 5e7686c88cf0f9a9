"""Latitude and longitude as x and y: metres north and east of the first fix, on the WGS 84 ellipsoid's radii there.

Source: Farrell 2008, Aided Navigation, section 2.3. Within 10 km of the fix the plane is off by less than 0.1 per cent.
"""

from __future__ import annotations

import numpy as np

from fieldsid.numerics.arrays import FloatArray

EQUATOR_M = 6378137.0
ECCENTRICITY_2 = 6.69437999014e-3


def north_and_east(degrees: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x and y (n,) in m of latitudes and longitudes (n, 2) in deg, from the first fix; NaN where there is none.

    A fix of just zero and zero, or outside of the globe, is none.
    """
    latitude, longitude = degrees.T
    bad = (np.abs(latitude) > 90.0) | (np.abs(longitude) > 360.0) | ((latitude == 0.0) & (longitude == 0.0))
    angles = np.radians(np.where(bad[:, None] | np.isnan(degrees), np.nan, degrees))
    seen = np.isfinite(angles).all(axis=1)
    if not seen.any():
        return np.full(len(degrees), np.nan), np.full(len(degrees), np.nan)
    start = angles[seen][0]
    flattened = 1.0 - ECCENTRICITY_2 * np.sin(start[0]) ** 2
    meridian = EQUATOR_M * (1.0 - ECCENTRICITY_2) / flattened**1.5
    parallel = EQUATOR_M / np.sqrt(flattened) * np.cos(start[0])
    east = np.remainder(angles[:, 1] - start[1] + np.pi, 2.0 * np.pi) - np.pi
    return meridian * (angles[:, 0] - start[0]), parallel * np.where(seen, east, np.nan)
