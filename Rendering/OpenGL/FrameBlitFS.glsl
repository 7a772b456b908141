//VTK::System::Dec

// Blends the splatter's frame over what is there: colour premultiplied (blend function ONE,
// ONE_MINUS_SRC_ALPHA), depth in window coordinates. Pixels that no splat touched stay as they are,
// unless the frame replaces what is there.

in vec2 texCoord;

uniform sampler2D frameColor; // RGBA, premultiplied
uniform sampler2D frameDepth; // R, window depth
uniform int replaces;

//VTK::Output::Dec

void main()
{
  vec4 color = texture(frameColor, texCoord);
  if (replaces == 0 && color.a <= 0.0)
  {
    discard;
  }
  gl_FragData[0] = color;
  gl_FragDepth = texture(frameDepth, texCoord).r;
}
