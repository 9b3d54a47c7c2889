"""ZMP preview control (Kajita et al.): a table-cart model follows the planned footsteps."""
