"""The walk of the first paper (Graf and Röfer): one file per stage, extensions in a folder."""
