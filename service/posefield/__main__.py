"""Entry point of `python -m posefield`: the `posefield` command."""

from posefield.cli import main

if __name__ == "__main__":
    main()
