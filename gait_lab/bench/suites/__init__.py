"""The benchmarks, one file each; `catalogue.py` lists them."""
