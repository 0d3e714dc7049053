"""The last results of a body."""

from cases.result_cache import ResultCache


def test_the_last_results_are_kept_and_the_one_not_asked_for_longest_goes():
    kept: ResultCache[str] = ResultCache(2)
    assert kept.get("a") is None
    kept.put("a", "A")
    kept.put(["b"], "B")  # without a hash
    assert kept.get("a") == "A"
    kept.put("c", "C")
    assert kept.get(["b"]) is None
    assert (kept.get("a"), kept.get("c")) == ("A", "C")
    kept.put("a", "A again")
    assert (kept.get("a"), kept.get("c")) == ("A again", "C")


def test_one_result():
    kept: ResultCache[int] = ResultCache(1)
    kept.put(1, 10)
    kept.put(2, 20)
    assert (kept.get(1), kept.get(2)) == (None, 20)
