# SPDX-License-Identifier: BSD-3-Clause
from .main import run

run()
