"""How many pieces of work are done: in this process or in several, in order and once each."""
