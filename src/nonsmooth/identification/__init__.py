"""Recordings to parameters of any system with their uncertainty, and experiment against theory."""

from nonsmooth.identification.finding import Estimate, Finding, correlated, uniform
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.identification.report import report

__all__ = ["Estimate", "Finding", "ParameterSet", "correlated", "report", "uniform"]
