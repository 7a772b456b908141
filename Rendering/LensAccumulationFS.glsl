//VTK::System::Dec

// Adds a view to the sum of views, or writes the mean of the sum.

in vec2 texCoord;

uniform sampler2D viewColor; // RGBA
uniform sampler2D viewDepth; // R, window depth
uniform float share;         // of the colour

//VTK::Output::Dec

void main()
{
  gl_FragData[0] = share * texture(viewColor, texCoord);
  gl_FragDepth = texture(viewDepth, texCoord).r;
}
