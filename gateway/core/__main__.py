"""``python -m gateway.core``."""

import sys

from gateway.core.process import main

sys.exit(main())
