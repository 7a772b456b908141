# What Doxygen reads instead of a header. Lines keep their numbers.

# A header's first comment is of the file, where it is not of a class.
2 {
  N
  /@class/! s|^/\*\*|/** @file|
}

# The same in all classes of VTK.
s|^  static vtk[A-Za-z]*\* New();|  /** Makes an object with default settings. */ &|

# What overrides VTK's methods and has no comment before it is documented there. The hold space has
# the line before.
/^  [^ ].*(.* override;$/ {
  x
  /^   \*\/$/! {
    x
    s|.*|/** @cond */ & /** @endcond */|
    x
  }
  x
}
h

# For subclasses.
s/^protected:/private:/
