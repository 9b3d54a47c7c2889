"""`nao_gait report`: one self-contained page about a recorded walk, or about two."""
