"""Parameters of any system from records over time and readings of steady states: the verbs, and what lies behind them.

One fit, from end to end: ``records`` and ``steady`` make `Record` and `SteadyReadings` of a recording, ``sensors`` the
`Unknowns`; together they are the problem, `Windows`. ``first_windows`` cuts it, ``first_level`` fits short windows from
a guess (``beginnings`` where states are hidden), ``growth`` joins them and finds the noise (``noise``), ``likelihood``
looks beside the minimum, and ``outcome`` makes the set of a `Grown`, with the rows of ``residuals``.

Every iteration runs through `Windows.residuals`: ``motion`` marches each window (a `SampledRun`, with derivatives where
asked), sensors read it, and `arrow.settle` takes the step. ``plan`` has the verbs that ask of runs not yet made, and of
models that were not fitted to a part.
"""
