// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/FullScreenQuad.h"

#include "Rendering/OpenGL/Functions.h"

#include <vtkOpenGLQuadHelper.h>
#include <vtkOpenGLShaderCache.h>
#include <vtkShaderProgram.h>

namespace SurfelSplatting
{
QuadState::QuadState(vtkOpenGLState* state)
  : Blend(state, GL_BLEND)
  , DepthTest(state, GL_DEPTH_TEST)
  , Cull(state, GL_CULL_FACE)
  , BlendFunction(state)
  , DepthFunction(state)
  , DepthMask(state)
{
  state->vtkglEnable(GL_BLEND);
  state->vtkglEnable(GL_DEPTH_TEST);
  state->vtkglDepthFunc(GL_ALWAYS);
  state->vtkglDepthMask(GL_TRUE);
  state->vtkglDisable(GL_CULL_FACE);
}

FullScreenQuad::FullScreenQuad(const char* fragmentShader)
  : FragmentShader(fragmentShader)
{
}

FullScreenQuad::~FullScreenQuad() = default;

vtkShaderProgram* FullScreenQuad::Use(vtkOpenGLRenderWindow* window)
{
  if (!this->Quad || this->Window != window || !this->Quad->Program)
  {
    this->Quad.reset(new vtkOpenGLQuadHelper(window, nullptr, this->FragmentShader, nullptr));
    this->Window = window;
  }
  else
  {
    window->GetShaderCache()->ReadyShaderProgram(this->Quad->Program);
  }
  vtkShaderProgram* program = this->Quad->Program;
  return program && program->GetCompiled() ? program : nullptr;
}

void FullScreenQuad::Draw()
{
  this->Quad->Render();
}

void FullScreenQuad::ReleaseGraphicsResources()
{
  this->Quad.reset();
}
}
