"""What tests and benchmarks share: plants, plans and recordings that the package does not know, and the board's wire.

In: names of effects and seeds. Out: recordings with a known truth. It imports the package, and nothing of the tests or
of the benchmarks' scripts.
"""
