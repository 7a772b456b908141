# SPDX-License-Identifier: BSD-3-Clause
"""What the shape of a cloud tells of it: what is up, rooms, parts that are inside out, its sensor."""
