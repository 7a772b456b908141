//VTK::System::Dec

// Draws the splatter's frame: premultiplied colour (blend function ONE, ONE_MINUS_SRC_ALPHA) and
// depth in window coordinates. Pixels that no splat touched are left unchanged, unless the frame
// replaces everything.

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
