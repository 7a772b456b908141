//VTK::System::Dec

// Adds a view to the sum of views, or writes the mean of the sum.

in vec2 texCoord;

uniform sampler2D viewColor;  // RGBA
uniform sampler2D viewDepth;  // R, window depth
uniform sampler2D belowColor; // RGBA, of the layers below
uniform float share;          // factor on the colour
uniform float deepest;        // largest depth of pixels with any colour
uniform int toLight;          // convert sRGB codes to light (LinearLight.h)
uniform int toCodes;          // convert light to sRGB codes
uniform int overBelow;        // mix with the layers below, as light

//VTK::Output::Dec

vec3 lightOfCode(vec3 code)
{
  vec3 v = max(code, vec3(0.0));
  return mix(pow((v + 0.055) / 1.055, vec3(2.4)), v / 12.92, vec3(lessThanEqual(v, vec3(0.04045))));
}

vec3 codeOfLight(vec3 light)
{
  vec3 v = max(light, vec3(0.0));
  return mix(1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, 12.92 * v,
    vec3(lessThanEqual(v, vec3(0.0031308))));
}

void main()
{
  vec4 color = share * texture(viewColor, texCoord);
  if (toLight == 1)
  {
    color.rgb = lightOfCode(color.rgb);
  }
  if (overBelow == 1)
  {
    vec4 below = texture(belowColor, texCoord);
    color += (1.0 - color.a) * vec4(lightOfCode(below.rgb), below.a);
  }
  if (toCodes == 1)
  {
    color.rgb = codeOfLight(color.rgb);
  }
  gl_FragData[0] = color;
  gl_FragDepth = min(texture(viewDepth, texCoord).r, color.a > 0.0 ? deepest : 1.0);
}
