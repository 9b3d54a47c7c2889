"""`nao_gait view`: the running robot in the browser."""
