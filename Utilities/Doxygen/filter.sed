# What Doxygen reads instead of a header. Lines keep their numbers; the hold space has the line before.

# A header's first comment is of the file, where it is not of a class.
2 {
  N
  /@class/! s|^/\*\*|/** @file|
}

# Indented formulas after an empty line are set as they stand: four spaces more.
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

# The same in all classes of VTK.
s|^  static vtk[A-Za-z]*\* New();|  /** Makes an object with default settings. */ &|
s|^  enum [A-Za-z]*s$|  /** Values of a setting below; see there. */ &|

# What overrides VTK's methods and has no comment is documented there. A declaration may have two
# lines, or a body.
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

# For subclasses.
s/^protected:/private:/
