"""What every node needs: its process, parameters, topics and the basic messages."""
