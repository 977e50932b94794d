"""The virtual rig of Savi et al. (2007), Fig. 3: recordings whose truth is known, all labelled synthetic."""

from nonsmooth_savi2007.rig.notebook import truth_path, write_cap, write_capstone_csv
from nonsmooth_savi2007.rig.truth import FEATURES, NOMINAL_GAP, UNITS, load_truth
from nonsmooth_savi2007.rig.virtual_rig import IDENTIFICATION, VirtualRig

__all__ = [
    "FEATURES",
    "IDENTIFICATION",
    "NOMINAL_GAP",
    "UNITS",
    "VirtualRig",
    "load_truth",
    "truth_path",
    "write_cap",
    "write_capstone_csv",
]
