"""ZMP preview control: the CoM of a table-cart model made for the footsteps that lie ahead."""
