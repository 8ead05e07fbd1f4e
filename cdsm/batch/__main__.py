"""``python -m cdsm.batch`` compiles the kernels ahead, in less than half a minute."""

from cdsm.batch.solution import compile_ahead

if __name__ == "__main__":
    compile_ahead()
