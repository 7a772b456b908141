// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/FrameQuad.h"

#include "FrameQuadFS.h"
#include "Rendering/OpenGL/Functions.h"

#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkShaderProgram.h>
#include <vtkTextureObject.h>

namespace SurfelSplatting
{
FrameQuad::FrameQuad()
  : Quad(FrameQuadFS)
{
}

bool FrameQuad::Draw(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle,
  const FrameTextures& textures, bool replace)
{
  vtkShaderProgram* program = this->Quad.Use(window);
  if (!program)
  {
    return false;
  }
  vtkOpenGLState* state = window->GetState();
  const QuadState quad(state); // no depth test: the splatter has left out hidden layers
  vtkOpenGLState::ScopedglViewport viewport(state);
  vtkOpenGLState::ScopedglScissor scissor(state);
  const GLenum under = replace ? GL_ZERO : GL_ONE_MINUS_SRC_ALPHA;
  state->vtkglBlendFuncSeparate(GL_ONE, under, GL_ONE, under);
  state->vtkglViewport(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height);
  state->vtkglScissor(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height);

  textures.Color->Activate();
  textures.Depth->Activate();
  program->SetUniformi("frameColor", textures.Color->GetTextureUnit());
  program->SetUniformi("frameDepth", textures.Depth->GetTextureUnit());
  program->SetUniformi("replaces", replace ? 1 : 0);
  this->Quad.Draw();
  textures.Depth->Deactivate();
  textures.Color->Deactivate();
  return true;
}
}
