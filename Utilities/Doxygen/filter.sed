# Turns a header into what Doxygen reads. Lines keep their numbers; the hold space has the line
# before.

# A header's first comment is about the file, unless it is about a class.
2 {
  N
  /@class/! s|^/\*\*|/** @file|
}

# Indented formulas after an empty line become code: four more spaces.
/^ *\*   *[^ ]/ {
  x
  /^ *\*$/ b formula
  /^ *\*       / b formula
  x
  b other
  :formula
  x
  s|^ *\*|&    |
  :other
}

# The same in every class.
s|^  static vtk[A-Za-z]*\* New();|  /** Makes an object with default settings. */ &|
s|^  enum [A-Za-z]*s$|  /** Values of a setting below; see there. */ &|

# Overridden methods without a comment are left out: VTK's pages have them. A declaration may have
# two lines or a body.
/^  [^ ].*($/ N
/^  [^ ].*(.* override$/ {
  :body
  N
  /\n  }$/! b body
}
/^  [^ ].*(.* override\(;\|\n  {.*\| {.*}\)$/ {
  x
  /^   \*\/$/ b documented
  x
  s|.*|/** @cond */ & /** @endcond */|
  x
  :documented
  x
}
h

# Protected members are left out.
s/^protected:/private:/
