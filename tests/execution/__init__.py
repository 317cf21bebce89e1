"""Many pieces of work: the same results in the same order, whatever happens to the workers."""
