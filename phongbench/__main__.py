"""`python -m phongbench`."""

from phongbench.cli.main import main

if __name__ == "__main__":
    main()
