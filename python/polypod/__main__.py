"""`python -m polypod` is the command `polypod`."""

from polypod.cli import main

if __name__ == "__main__":
    main()
