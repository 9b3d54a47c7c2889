"""The suites of `nao_gait bench`: each file with a `SUITE` is one of them."""
