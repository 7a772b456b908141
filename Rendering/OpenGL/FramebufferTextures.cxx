// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/FramebufferTextures.h"

#include "Rendering/OpenGL/Functions.h"

#include <vtkRenderer.h>
#include <vtkSMPTools.h>

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
/// A texture of the bound draw framebuffer.
struct AttachedTexture
{
  GLuint Name = 0; ///< 0: there is none
  GLint Format = GL_NONE;

  explicit AttachedTexture(GLenum plane)
  {
    const auto ask = [plane](GLenum what) {
      GLint value = 0;
      glGetFramebufferAttachmentParameteriv(GL_DRAW_FRAMEBUFFER, plane, what, &value);
      return value;
    };
    if (ask(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) == GL_TEXTURE &&
      ask(GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL) == 0)
    {
      this->Name = static_cast<GLuint>(ask(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
      glBindTexture(GL_TEXTURE_2D, this->Name);
      glGetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_INTERNAL_FORMAT, &this->Format);
    }
  }

  void Copy(const PixelRectangle& r, GLenum format, GLenum type, const void* values) const
  {
    glBindTexture(GL_TEXTURE_2D, this->Name);
    glTexSubImage2D(GL_TEXTURE_2D, 0, r.X, r.Y, r.Width, r.Height, format, type, values);
  }
};

/// Keeps the texture that is bound, and how rows of main memory are aligned.
class TextureState
{
public:
  TextureState()
  {
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &this->Bound);
    glGetIntegerv(GL_UNPACK_ALIGNMENT, &this->Alignment);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  }
  ~TextureState()
  {
    glPixelStorei(GL_UNPACK_ALIGNMENT, this->Alignment);
    glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(this->Bound));
  }
  TextureState(const TextureState&) = delete;
  TextureState& operator=(const TextureState&) = delete;

private:
  GLint Bound = 0, Alignment = 4;
};

/// 255 times a value, rounded; values outside of [0, 1] are clamped.
unsigned char ToByte(float value)
{
  const float positive = value > 0.0f ? value : 0.0f;
  return static_cast<unsigned char>((positive < 1.0f ? positive : 1.0f) * 255.0f + 0.5f);
}

/// A depth in [0, 1] as an integer.
std::uint32_t ToInteger(float depth)
{
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(depth * 4294967295.0 + 0.5));
}

/// Whether a framebuffer whose first colours are drawn to has samples or another buffer.
bool IsSimple()
{
  GLint framebuffer = 0, buffer = GL_NONE, samples = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
  glGetIntegerv(GL_DRAW_BUFFER0, &buffer);
  glGetIntegerv(GL_SAMPLES, &samples);
  return framebuffer != 0 && buffer == GL_COLOR_ATTACHMENT0 && samples == 0;
}
}

bool HasPlainBackground(vtkRenderer* renderer)
{
  return renderer->GetErase() && !renderer->GetPreserveColorBuffer() &&
    !renderer->GetGradientBackground() && !renderer->GetTexturedBackground();
}

bool FramebufferTextures::Copy(const PixelRectangle& rectangle, const float* color,
  const float* windowDepth, const float under[4])
{
  if (!IsSimple())
  {
    return false;
  }
  const TextureState state;
  const AttachedTexture colors(GL_COLOR_ATTACHMENT0), depths(GL_DEPTH_ATTACHMENT);
  const bool isFloat = depths.Format == GL_DEPTH_COMPONENT32F;
  if (colors.Format != GL_RGBA8 ||
    !(isFloat || depths.Format == GL_DEPTH_COMPONENT16 || depths.Format == GL_DEPTH_COMPONENT24 ||
      depths.Format == GL_DEPTH_COMPONENT32))
  {
    return false;
  }
  const std::size_t pixels = static_cast<std::size_t>(rectangle.Width) * rectangle.Height;
  this->Bytes.resize(4 * pixels);
  this->Depths.resize(isFloat ? 0 : pixels);
  unsigned char* bytes = this->Bytes.data();
  std::uint32_t* integers = this->Depths.data();
  vtkSMPTools::For(0, static_cast<vtkIdType>(pixels), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType p = begin; p < end; ++p)
    {
      const float through = 1.0f - color[4 * p + 3];
      for (int c = 0; c < 4; ++c)
      {
        bytes[4 * p + c] = ToByte(color[4 * p + c] + through * under[c]);
      }
    }
    if (!isFloat)
    {
      std::transform(windowDepth + begin, windowDepth + end, integers + begin, ToInteger);
    }
  });
  colors.Copy(rectangle, GL_RGBA, GL_UNSIGNED_BYTE, bytes);
  depths.Copy(rectangle, GL_DEPTH_COMPONENT, isFloat ? GL_FLOAT : GL_UNSIGNED_INT,
    isFloat ? static_cast<const void*>(windowDepth) : integers);
  return true;
}
}
