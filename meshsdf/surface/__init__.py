"""field -> mesh: marching squares and cubes, dual contouring."""
