"""`python -m semascan_training`."""

from .cli import main

raise SystemExit(main())
