# SPDX-License-Identifier: BSD-3-Clause
"""Views: cameras with a lens, from files and options, or fitted to a cloud."""
