"""`python -m phongbench`."""

from phongbench.cli import main

if __name__ == "__main__":
    main()
