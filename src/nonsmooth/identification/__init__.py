"""Recordings to parameters with uncertainty, and experiment against theory."""

from nonsmooth.identification.chain import identify
from nonsmooth.identification.evidence import Evidence, Run, gather
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.parameter_set import ParameterSet

__all__ = ["Estimate", "Evidence", "Finding", "ParameterSet", "Run", "gather", "identify"]
