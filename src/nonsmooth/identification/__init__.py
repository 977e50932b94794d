"""Recordings to parameters of any system with their uncertainty, and experiment against theory."""

from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.identification.report import report
from nonsmooth.identification.uncertainty import correlated, uniform

__all__ = ["Estimate", "Finding", "ParameterSet", "correlated", "report", "uniform"]
