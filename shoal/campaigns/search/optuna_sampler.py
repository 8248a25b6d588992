"""Asks Optuna which values to try next."""

import warnings
from collections.abc import Sequence
from typing import Any

from shoal.campaigns.optional_import import import_optional
from shoal.campaigns.search.search_space import SearchAxis, ValueChanges

RANDOM = 10  # trials that Optuna needs for a model
TRIES = 20  # draws per trial, to avoid one that was done already


def suggest_trials(
    axes: Sequence[SearchAxis], completed: Sequence[tuple[ValueChanges, float]], *, count: int, seed: int, largest: bool
) -> list[ValueChanges]:
    """The next `count` trials, none of which has been done; fewer if there is nothing left to try.

    `completed` are trials with what came of them, NaN if that is not known. The answer depends on the arguments alone:
    Optuna's sampler (TPE, J. Bergstra 2011) begins anew, so that a search may be ended between any two of these calls.
    Raises ModuleNotFoundError without Optuna.
    """
    optuna = import_optional("optuna")
    kinds = optuna.distributions
    space = {
        axis.place: kinds.FloatDistribution(0.0, 1.0)
        if axis.is_ordered
        else kinds.CategoricalDistribution(range(len(axis.levels)))
        for axis in axes
    }
    done = {_key(axes, values): value for values, value in completed}
    level = optuna.logging.get_verbosity()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that options are experimental
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        try:
            sampler = optuna.samplers.TPESampler(
                seed=seed, multivariate=True, constant_liar=True, n_startup_trials=RANDOM
            )
            study = optuna.create_study(sampler=sampler, direction="maximize" if largest else "minimize")
            for values, value in completed:
                study.add_trial(_trial(optuna, axes, space, values, value))
            return _new(study, axes, space, done, count)
        finally:
            optuna.logging.set_verbosity(level)


def _new(study: Any, axes: Sequence[SearchAxis], space: Any, done: dict[Any, float], count: int) -> list[ValueChanges]:
    found: dict[Any, ValueChanges] = {}
    for _ in range(count * TRIES):
        if len(found) == count:
            break
        trial = study.ask(space)
        values = {axis.place: axis.value_at(trial.params[axis.place]) for axis in axes}
        key = _key(axes, values)
        if key not in done:
            found.setdefault(key, values)
        elif done[key] == done[key]:
            study.tell(trial, done[key])
    return list(found.values())


def _trial(optuna: Any, axes: Sequence[SearchAxis], space: Any, values: ValueChanges, value: float) -> Any:
    shares = {axis.place: axis.position_of(values[axis.place]) for axis in axes}
    known = value == value
    state = optuna.trial.TrialState.COMPLETE if known else optuna.trial.TrialState.FAIL
    return optuna.trial.create_trial(params=shares, distributions=space, value=value if known else None, state=state)


def _key(axes: Sequence[SearchAxis], values: ValueChanges) -> tuple[object, ...]:
    return tuple(values[axis.place] for axis in axes)
