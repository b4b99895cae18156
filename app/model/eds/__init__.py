"""Reads electronic data sheets (EDS) and device configuration files (DCF) of any vendor, CiA 306.

Data sheets in the field are full of mistakes: whatever can be understood is taken, whatever cannot is left out with a
warning that names the line.
"""

from app.model.eds.file import LoadedEds, load_eds, read_eds
from app.model.eds.ini import EdsWarning

__all__ = ["EdsWarning", "LoadedEds", "load_eds", "read_eds"]
