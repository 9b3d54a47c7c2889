"""Team: messages between team mates, and who plays which role."""
