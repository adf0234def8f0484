"""Finding sensor designs: the joint method, searches, and specialists that designs are judged by.

:mod:`.gaussian` is the design policy, :mod:`.joint` trains it beside the control policy; :mod:`.search` holds the
baselines, :mod:`.methods` names them all, :mod:`.specialist` says what a design is worth; :mod:`.optimize` runs a
search from start to end and :mod:`.sweep` many specialists side by side. A score without training is the task's own
(:class:`prnav.contracts.ProbeSpec`).
"""
