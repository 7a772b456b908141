// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/FramebufferTextures.h"

#include "Rendering/OpenGL/Functions.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkRenderer.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace SurfelSplatting
{
namespace
{
/// Few enough for their values to stay in a cache of the processor's.
constexpr std::size_t PixelsPerPiece = 4096;

/// A texture of the bound draw framebuffer.
struct AttachedTexture
{
  GLuint Name = 0; ///< 0: there is none
  GLint Format = GL_NONE;

  AttachedTexture() = default;

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

// Four components at a time; GCC does not find this in loops over bytes.
using Four = float __attribute__((vector_size(16)));
using FourIntegers = std::int32_t __attribute__((vector_size(16)));

/// Four integers in [0, 255] as bytes.
std::int32_t Pack(const FourIntegers& integers)
{
#if defined(__SSE2__)
  const __m128i values = reinterpret_cast<const __m128i&>(integers);
  const __m128i shorts = _mm_packs_epi32(values, values);
  return _mm_cvtsi128_si32(_mm_packus_epi16(shorts, shorts));
#else
  using FourBytes = unsigned char __attribute__((vector_size(4)));
  const auto bytes = __builtin_convertvector(integers, FourBytes);
  std::int32_t packed;
  std::memcpy(&packed, &bytes, sizeof(packed));
  return packed;
#endif
}

/// Mixes colours over one colour, 255 times, rounded; values outside of [0, 1] are clamped.
void ToBytes(const float* color, std::size_t pixels, const float under[4], unsigned char* bytes)
{
  Four below;
  std::memcpy(&below, under, sizeof(below));
  const Four zero = { 0.0f, 0.0f, 0.0f, 0.0f };
  const Four one = { 1.0f, 1.0f, 1.0f, 1.0f };
  for (std::size_t p = 0; p < pixels; ++p)
  {
    Four value;
    std::memcpy(&value, color + 4 * p, sizeof(value));
    value += (1.0f - value[3]) * below;
    value = value > zero ? value : zero;
    value = value < one ? value : one;
    const auto integers = __builtin_convertvector(value * 255.0f + 0.5f, FourIntegers);
    const std::int32_t packed = Pack(integers);
    std::memcpy(bytes + 4 * p, &packed, sizeof(packed));
  }
}

/// A depth in [0, 1] as an integer. Processors convert to signed ones.
std::uint32_t ToInteger(float depth)
{
  const auto shifted = static_cast<std::int32_t>(depth * 4294967295.0 - 2147483648.0);
  return static_cast<std::uint32_t>(shifted) ^ 0x80000000u;
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

/// Textures to write to.
struct FramebufferTextures::Attachments
{
  AttachedTexture Colors, Depths;

  Attachments()
  {
    if (IsSimple())
    {
      const TextureState state;
      this->Colors = AttachedTexture(GL_COLOR_ATTACHMENT0);
      this->Depths = AttachedTexture(GL_DEPTH_ATTACHMENT);
    }
  }

  bool HasFloatDepths() const { return this->Depths.Format == GL_DEPTH_COMPONENT32F; }

  bool AreKnown() const
  {
    const GLint depth = this->Depths.Format;
    return this->Colors.Format == GL_RGBA8 &&
      (this->HasFloatDepths() || depth == GL_DEPTH_COMPONENT16 || depth == GL_DEPTH_COMPONENT24 ||
        depth == GL_DEPTH_COMPONENT32);
  }
};

/// Where a frame is written to.
struct FramebufferTextures::Destination
{
  unsigned char* Color;
  float* Depth;            // null: floats are where they are wanted
  std::uint32_t* Integers; // null: no integers are wanted
};

/// Prepares pixels and writes them with all threads, a few at a time.
void FramebufferTextures::Write(
  std::size_t pixels, const FramePixels& frame, const RangeFunction& prepare, const Destination& to)
{
  SMPExecutor().For(pixels, PixelsPerPiece, [&](std::size_t begin, std::size_t end) {
    prepare(begin, end);
    ToBytes(frame.Color + 4 * begin, end - begin, frame.Under, to.Color + 4 * begin);
    if (to.Depth)
    {
      std::copy(frame.Depth + begin, frame.Depth + end, to.Depth + begin);
    }
    if (to.Integers)
    {
      std::transform(frame.Depth + begin, frame.Depth + end, to.Integers + begin, ToInteger);
    }
  });
}

bool FramebufferTextures::Copy(
  const PassFrame& target, const FramePixels& frame, const RangeFunction& prepare)
{
  const Attachments attachments;
  if (!attachments.AreKnown())
  {
    return false;
  }
  const PixelRectangle& rectangle = target.Rectangle;
  const std::size_t pixels = static_cast<std::size_t>(rectangle.Width) * rectangle.Height;
  this->Bytes.clear();
  this->Depths.clear();
  const auto nothing = [](std::size_t, std::size_t) {};
  bool isPrepared = false;
  if (BufferedFrame::IsWorthwhile())
  {
    const BufferedFrame::Memory memory = this->Buffers.Begin(target.Window, rectangle);
    isPrepared = memory.Color != nullptr;
    if (isPrepared)
    {
      Write(pixels, frame, prepare, { memory.Color, memory.Depth, nullptr });
      if (this->Buffers.Draw(target.Window, rectangle))
      {
        return true;
      }
    }
  }
  const bool isFloat = attachments.HasFloatDepths();
  this->Bytes.resize(4 * pixels);
  this->Depths.resize(isFloat ? 0 : pixels);
  Write(pixels, frame, isPrepared ? RangeFunction(nothing) : prepare,
    { this->Bytes.data(), nullptr, isFloat ? nullptr : this->Depths.data() });
  this->Upload(rectangle, frame, attachments);
  return true;
}

bool FramebufferTextures::CopyAgain(const PassFrame& target, const FramePixels& frame)
{
  const Attachments attachments;
  if (!attachments.AreKnown())
  {
    return false;
  }
  if (this->Bytes.empty())
  {
    return this->Buffers.DrawAgain(target.Window, target.Rectangle);
  }
  const PixelRectangle& rectangle = target.Rectangle;
  const std::size_t pixels = static_cast<std::size_t>(rectangle.Width) * rectangle.Height;
  if (this->Bytes.size() != 4 * pixels ||
    this->Depths.size() != (attachments.HasFloatDepths() ? 0 : pixels))
  {
    return false;
  }
  this->Upload(rectangle, frame, attachments);
  return true;
}

void FramebufferTextures::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Buffers.ReleaseGraphicsResources(window);
}

void FramebufferTextures::Upload(
  const PixelRectangle& rectangle, const FramePixels& frame, const Attachments& to)
{
  const TextureState state;
  const bool isFloat = to.HasFloatDepths();
  to.Colors.Copy(rectangle, GL_RGBA, GL_UNSIGNED_BYTE, this->Bytes.data());
  to.Depths.Copy(rectangle, GL_DEPTH_COMPONENT, isFloat ? GL_FLOAT : GL_UNSIGNED_INT,
    isFloat ? static_cast<const void*>(frame.Depth) : this->Depths.data());
}
}
