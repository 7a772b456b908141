# SPDX-License-Identifier: BSD-3-Clause
"""Point clouds: what is known of one, and what holds for the files of all formats."""
