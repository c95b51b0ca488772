"""`python -m forestall`: the same as the `forestall` command."""

from forestall.cli.main import main

if __name__ == "__main__":
    main()
