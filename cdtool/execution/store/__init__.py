"""The store of outcomes that were computed before: found by what determined them, so that nothing is computed twice."""
