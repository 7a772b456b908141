# SPDX-License-Identifier: BSD-3-Clause
"""pvpython runtests.py TestA TestB...: runs these files in one process, whose start takes 3 s."""

import os
import sys
import unittest

result = unittest.TextTestRunner(verbosity=2).run(
    unittest.defaultTestLoader.loadTestsFromNames(sys.argv[1:]))
sys.stdout.flush()
sys.stderr.flush()
os._exit(0 if result.wasSuccessful() else 1)  # pvpython's own end takes no status
