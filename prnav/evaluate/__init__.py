"""Evaluation: an explicit list of episodes, any agent, records that do not depend on how they were made.

:mod:`prnav.evaluate.evaluation` plays a task's episodes through :func:`prnav.play.play`, :mod:`prnav.evaluate.records`
keeps what happened, :mod:`prnav.evaluate.intervals` and :mod:`prnav.evaluate.summary` say what it means,
:mod:`prnav.evaluate.learned` makes an agent of a training run. Only ``learned`` imports torch, so the report can read
records without it.
"""
