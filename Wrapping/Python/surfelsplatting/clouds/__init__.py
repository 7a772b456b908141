# SPDX-License-Identifier: BSD-3-Clause
"""Point clouds from files."""
