//VTK::System::Dec

// Adds a view to the sum of views, or writes the mean of the sum.

in vec2 texCoord;

uniform sampler2D viewColor; // RGBA
uniform sampler2D viewDepth; // R, window depth
uniform float share;         // of the colour
uniform int toLight;         // colours are sRGB codes, their sum is of light (LinearLight.h)
uniform int toCodes;         // the sum is of light, its mean shown as sRGB codes

//VTK::Output::Dec

void main()
{
  vec4 color = share * texture(viewColor, texCoord);
  if (toLight == 1)
  {
    vec3 v = max(color.rgb, vec3(0.0));
    color.rgb = mix(
      pow((v + 0.055) / 1.055, vec3(2.4)), v / 12.92, vec3(lessThanEqual(v, vec3(0.04045))));
  }
  if (toCodes == 1)
  {
    vec3 v = max(color.rgb, vec3(0.0));
    color.rgb = mix(1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, 12.92 * v,
      vec3(lessThanEqual(v, vec3(0.0031308))));
  }
  gl_FragData[0] = color;
  gl_FragDepth = texture(viewDepth, texCoord).r;
}
