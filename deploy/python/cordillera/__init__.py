"""Client of a Cordillera service: post a raster, watch its build, fetch tiles, ask for heights.

    import cordillera

    service = cordillera.Service("http://127.0.0.1:8080")
    dataset = service.post("dem.tif", error=5)
    for progress in dataset.watch():
        print(progress.stage, progress.share)
    print(dataset.elevation(-71.3033, 44.2706).orthometric_m)
"""
from .dataset import Dataset
from .heights import Height, Profile
from .problem import Problem
from .progress import Progress
from .service import Service

__all__ = ["Dataset", "Height", "Problem", "Profile", "Progress", "Service"]
__version__ = "0.1.0"
