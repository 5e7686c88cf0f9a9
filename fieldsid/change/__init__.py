"""Before and after: what a swap has changed of a vehicle's parameters, its turning radius and its gains."""
