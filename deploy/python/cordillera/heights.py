"""Heights at places and along lines, from the meshes that maps show."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping, Optional, Sequence, Tuple

Place = Tuple[float, float]
"""Longitude and latitude in degrees."""
MOST_PLACES = 5000
"""of one request"""


@dataclass(frozen=True)
class Height:
    longitude_deg: float
    latitude_deg: float
    ellipsoidal_m: Optional[float]
    """above the ellipsoid of WGS 84; None where the dataset has no data"""
    orthometric_m: Optional[float]
    """above the geoid that the raster's heights count from; None without data, and where no grid of the geoid is installed"""
    stated_error_m: Optional[float]
    """the greatest distance of the level's mesh from the samples; None of provisional tiles, and where the level shows nothing"""
    distance_m: Optional[float] = None
    """along a line, from its beginning"""

    @classmethod
    def of(cls, point: Mapping[str, Any], answer: Mapping[str, Any]) -> Height:
        return cls(point["lon"], point["lat"], point.get("ellipsoidal_height"), point.get("orthometric_height"),
                   answer.get("stated_max_error"), point.get("distance"))


@dataclass(frozen=True)
class Profile:
    length_m: float
    heights: Sequence[Height]
