"""What leaves the house: the folder of a flight, and the paper's section VI drawn again."""
