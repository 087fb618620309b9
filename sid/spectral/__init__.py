"""What is made of the eigenpairs: the irregularity of the spectrum, and signatures of the vertices."""
