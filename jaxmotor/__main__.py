import sys

from jaxmotor.cli import main

sys.exit(main())
