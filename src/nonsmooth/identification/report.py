"""A parameter set as a page to read: parameters, what they rest on, the findings with their notes."""

from __future__ import annotations

from nonsmooth.identification.parameter_set import ParameterSet


def report(found: ParameterSet, title: str = "Identified parameters") -> str:
    """The set as Markdown.

    Parameters
    ----------
    found : ParameterSet
    title : str
        Heading; ``(synthetic recordings)`` is added where it applies.
    """
    lines = [f"# {title}{' (synthetic recordings)' if found.synthetic else ''}", ""]
    lines += ["| parameter | value | 95 % interval | unit | what it rests on |", "|---|---|---|---|---|"]
    for group in (found.estimates, found.extra):
        for name, estimate in group.items():
            said = found.identifiability.get(name, "" if name in found.estimates else "beside the model's parameters")
            low, high = estimate.interval()
            value = str(estimate).removesuffix(f" {estimate.unit}")
            lines.append(f"| {name} | {value} | {low:.6g} to {high:.6g} | {estimate.unit} | {said} |")
    lines += ["", *(f"- {note}" for note in found.notes), "", "## Correlations", "", *_correlations(found)]
    lines += ["", "## Findings"]
    for finding in found.findings:
        lines += ["", f"### {finding.name} = {finding.estimate}", "", f"{finding.method}; from {finding.used}.", ""]
        lines += [f"- {name} = {other}" for name, other in finding.others.items()]
        lines += [f"- {note}" for note in finding.notes]
    return "\n".join(lines) + "\n"


def _correlations(found: ParameterSet) -> list[str]:
    names = list(found)
    matrix = found.covariance.values
    size = matrix.diagonal() ** 0.5
    lines = ["| | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for i, name in enumerate(names):
        row = [f"{matrix[i, j] / (size[i] * size[j]):+.2f}" if size[i] * size[j] else "" for j in range(len(names))]
        lines.append(f"| {name} | " + " | ".join(row) + " |")
    return lines
