"""What observers have in common that see every step and look for no section."""

from nonsmooth.kernels.compile.cache import once


@once
def may_stride(i, form, net, section, seen):
    """Every step is seen."""
    return False


@once
def hurry(i, form, net, section, goal, seen, tables, work, patience):
    """Every step is seen."""
    return False, False, patience


@once
def arrive(i, code, source, t, sense, state, form, section, goal, seen, tables, work):
    """No section is looked for."""
    return code
