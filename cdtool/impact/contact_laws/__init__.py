"""Contact laws: from penetration and its rate to the force between two bodies. One file per law."""
