"""A rate and a burst, of one and of many."""

from support.token_bucket import TokenBucket, TokenBuckets


def test_a_burst_passes_at_once_and_then_the_rate() -> None:
    bucket = TokenBucket(10.0, 40.0)
    assert sum(bucket.try_acquire(1e9) for _ in range(100)) == 40
    assert sum(bucket.try_acquire(1e9 + second) for second in range(1, 11) for _ in range(100)) == 100
    assert sum(bucket.try_acquire(2e9) for _ in range(100)) == 40, "a pause gives no more than the burst"


def test_what_costs_more_than_is_left_takes_nothing() -> None:
    bucket = TokenBucket(1.0, 10.0)
    assert not bucket.try_acquire(0.0, 11.0)
    assert bucket.try_acquire(0.0, 10.0)
    assert bucket.refill(4.0) == 4.0
    assert not bucket.try_acquire(4.0, 5.0)


def test_a_clock_that_is_set_back_neither_gives_nor_takes() -> None:
    bucket = TokenBucket(1.0, 2.0)
    assert bucket.try_acquire(100.0, 2.0)
    assert not bucket.try_acquire(50.0)
    assert bucket.try_acquire(51.0)


def test_what_has_passed_already_is_paid_by_waiting() -> None:
    bucket = TokenBucket(10.0, 10.0)
    assert bucket.spend(0.0, 10.0) == 0.0
    assert bucket.spend(0.0, 25.0) == 2.5
    assert bucket.spend(2.5, 0.0) == 0.0


def test_each_has_its_own_bucket_and_the_one_that_was_used_longest_ago_gives_way() -> None:
    buckets = TokenBuckets(1.0, 1.0, 2)
    assert [buckets[name].try_acquire(0.0) for name in "aab"] == [True, False, True]
    assert buckets["c"].try_acquire(0.0)
    assert len(buckets) == 2
    assert not buckets["b"].try_acquire(0.0)
    assert buckets["a"].left == 1.0, "it is new again"


def test_many_who_ask_once_do_not_give_a_new_budget_to_one_who_asks_all_the_time() -> None:
    buckets = TokenBuckets(1.0, 1.0, 4)
    assert buckets["loud"].try_acquire(0.0)
    for stranger in range(20):
        buckets[stranger].try_acquire(0.0)
        assert not buckets["loud"].try_acquire(0.0)
