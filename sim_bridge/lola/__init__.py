"""LoLA in front of a simulated robot: an emulator of a NAO V6 for any program that speaks LoLA."""
