"""Arguments without meaning are refused by name, with the next step."""

from __future__ import annotations

import math
from functools import partial

import pytest

from cdtool.base.errors import UsageError
from cdtool.statistics.kaplan_meier import latency_quantile
from cdtool.statistics.paired import fisher_p, holm, mcnemar_p, paired_difference, unpaired_difference
from cdtool.statistics.prediction import prediction_of
from cdtool.statistics.rates import (
    binomial_at_most,
    binomial_increase_at_most,
    binomial_share,
    poisson_at_most,
    poisson_difference_p,
    poisson_increase_at_most,
    poisson_rate,
)
from cdtool.statistics.sample_size import (
    detectable_difference,
    exposure_for_rate,
    impacts_for_difference,
    impacts_for_missed_share,
    impacts_for_unpaired,
)
from cdtool.statistics.spread import mean_interval


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (partial(latency_quantile, [1.0, 2.0], [False], 0.5), "do not match"),
        (partial(latency_quantile, [1.0, math.nan], [False, True], 0.5), "missing or below 0"),
        (partial(latency_quantile, [-1.0], [False], 0.5), "missing or below 0"),
        (partial(latency_quantile, [1.0], [False], 95), "quantile is 95"),
        (partial(latency_quantile, [1.0], [False], 0.5, 95), "confidence level is 95"),
        (partial(mean_interval, [1.0, 2.0], [0]), "do not match"),
        (partial(mean_interval, [1.0, math.inf], [0, 1]), "missing or infinite"),
        (partial(mean_interval, [1.0, 2.0], [0, 1], 1.0), "confidence level is 1"),
        (partial(paired_difference, [1.0, math.nan], [0, 1]), "missing or infinite"),
        (partial(paired_difference, [1.0], [0, 1]), "do not match"),
        (partial(unpaired_difference, [1.0], [math.inf], [0], [0]), "missing or infinite"),
        (partial(mcnemar_p, -1, 2), "only_first is -1"),
        (partial(fisher_p, 3, 2, 0, 2), "3 of 2 is more than all"),
        (partial(holm, [0.5, 1.5]), "outside 0 to 1"),
        (partial(poisson_rate, 1.5, 1.0), "number of events is 1.5"),
        (partial(poisson_rate, 1, math.nan), "exposure is nan"),
        (partial(poisson_at_most, 1, math.inf), "exposure is inf"),
        (partial(poisson_difference_p, 1, -1.0, 1, 1.0), "exposure is -1"),
        (partial(poisson_increase_at_most, 0, 100.0, 3, -5.0), "exposure is -5"),
        (partial(binomial_increase_at_most, -3, 0, 0, 5), "count is -3"),
        (partial(binomial_share, 3, 2), "3 of 2 is more than all"),
        (partial(binomial_at_most, 0, -2), "n is -2"),
        (partial(impacts_for_difference, 0.0, 10.0), "difference is 0"),
        (partial(impacts_for_difference, 5.0, 10.0, power=1.0), "power is 1"),
        (partial(impacts_for_difference, 1e-6, 10.0), "more than 10000000 impacts"),
        (partial(impacts_for_unpaired, 5.0, math.nan), "standard deviation is nan"),
        (partial(detectable_difference, 1, 10.0), "n is 1"),
        (partial(impacts_for_missed_share, 1.0), "missed share is 1"),
        (partial(impacts_for_missed_share, 0.05, -1), "allowed_missed is -1"),
        (partial(impacts_for_missed_share, 1e-9), "more than 10000000 impacts"),
        (partial(exposure_for_rate, 0.0), "rate is 0"),
        (partial(prediction_of, [1.0, 2.0]), "values to predict from"),
        (partial(prediction_of, [1.0, math.nan, 2.0]), "values to predict from"),
    ],
)
def test_an_argument_without_meaning_is_refused(call, said):
    with pytest.raises(UsageError, match=said) as fault:
        call()
    assert fault.value.hint
